"""What the speed's equation is of usual ships: priors of what a turn costs, and what may cost it."""

from __future__ import annotations

import numpy as np

#: of tau: ships come back to their speed in some lengths to some dozens of them; median, and its logarithm's spread
TAU_MEDIAN, TAU_SPREAD = 8.0, 0.7
#: tau as it is gone through, in ship lengths
TAU = np.exp(np.linspace(np.log(1.0), np.log(64.0), 121))
#: the kinds of loss: by drift and turn, by the turn, by the rudder, by the wind
BY_DRIFT, BY_RATE, BY_RUDDER, BY_WIND = KINDS = range(4)
#: of k_vr / tau, of k_r where turn alone counts, of k_d and of k_w / tau: with (L r / V)^2 of 0.1 to 0.2 in a hard turn
#: a loss of 20 to 60 %; 0.4 rad of rudder cost some percent
LOSS_MEAN, LOSS_STD = np.array([1.3, 2.0, 0.3, 0.001]), np.array([0.6, 2.0, 0.3, 0.001])
#: of k_r / tau beside drift, of either sign: x_G m and X_rr of usual ships come to -0.15 to 0.05
BESIDE_MEAN, BESIDE_STD = -0.05, 0.2
#: of V_0 about V_s: of a run that begins settled, and of one that gathers way; from where on it is the latter
SETTLED_STD, UNSETTLED_STD, UNSETTLED = 0.03, 0.15, 0.1
