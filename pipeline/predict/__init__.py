"""What a model predicts of a manoeuvre: one step, some seconds ahead, running free; and what is left over."""
