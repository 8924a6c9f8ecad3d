"""Do the intervals of `kempf predict` hold? Ships identified from zigzags in wind and stream, predicted in calm water.

`plain_ship` has the ships whose model is right as it stands, `hidden_ship` those with an effect that the plain model
lacks. What is predicted is compared with what a simulator sails that shares no code with the prediction.
"""
