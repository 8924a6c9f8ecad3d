"""How a job runs on this machine: cores, progress, memory, commits, unexpected errors."""
