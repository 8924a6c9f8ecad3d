"""How wide a 95 % interval is, wherever one is made, stored, drawn or held against the truth."""

#: Standard errors from the middle of a 95 % interval to either end: the 0.975 quantile of the standard normal
#: distribution, to the last bit of a double (`scipy.special.ndtri`).
NORMAL_95 = 1.959963984540054
