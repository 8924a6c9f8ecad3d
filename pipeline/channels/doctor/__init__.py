"""The channel doctor: which channel of a log lies, how, and what would mend it. One check a file; blame last."""
