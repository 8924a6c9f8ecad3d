"""The states of eq. (16) in the order in which every filter and every step has them."""

#: lateral speed, yaw rate, heading, wind force, yaw acceleration beside its moment; rows and columns of a matrix
CHAIN = 0, 1, 2, 3, 4
V, R, PSI, F, M = CHAIN
N_CHAIN = 5
