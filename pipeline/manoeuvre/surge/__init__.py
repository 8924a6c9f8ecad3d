"""The speed of a ship in a turn, identified from what her log showed in the manoeuvres.

    dV/dt = (V_0 (1 - loss) - V) V_s / (tau L),
    loss = -k_vr L v r / V_s^2 + k_r (L r / V_s)^2 + k_d delta^2 (V / V_s)^p + k_w W / V_s^2

V_s is the speed that the shaft keeps on a straight course, V_0 that of one manoeuvre, tau the time in ship lengths in
which she finds it; the rest is what turn and rudder cost of it in the long run, without a dimension. Thrust falls and
resistance rises with the speed, so that their difference is close to a straight line down to half of it. A ship that
drifts while she turns loses by the momentum of her sideways motion, (m + m_y) v r / (m + m_x), and regains some of it
by X_vr: k_vr / tau is 1 to 1.6 (Yasukawa & Yoshimura 2015, "Introduction of MMG standard method for ship maneuvering
predictions", J. Mar. Sci. Technol. 20; Norrbin 1971, "Theory and observations on the use of a mathematical model for
ship manoeuvring in deep and confined waters", SSPA publication 68). Beside drift the yaw rate squared has either sign:
a centre of gravity before midships pushes her on in a turn, m x_G r^2, and what the hull's longitudinal force has of
it, X_rr, does the one or the other. Where no lateral speed was measured, or where the log shows it better, the loss
goes by the yaw rate alone, as drift goes with turn.

The rudder's drag goes with its force, and so with the power p of the speed that the model has it go by.

W is the wind over the deck, its speed times its part from ahead, less what her own way makes of it in calm air: a head
wind costs speed and a following one gives some. k_w / tau is the air's density times the drag area, over twice the
mass per length: about 0.001 (Isherwood 1972, "Wind resistance of merchant ships", Trans. RINA 115), which for a small
model in a breeze is a tenth of her speed.

Whether it takes her a way or a time to find her speed shows where the shaft turned at several speeds: by a resistance
that goes with the speed squared it is tau lengths at any, by an engine or a resistance of another kind it may be the
same seconds at every. Both are forms, the second as tau lengths at the mean V_s; logs of one shaft speed have the first
alone.

For a given tau and one of the forms all else enters linearly. So tau is gone through on a grid, and at each value the
rest is a linear regression with priors: the posterior is exact but for the grid, and needs no start. Which of the terms
there are beside the one by turning is left to their evidence.
"""
