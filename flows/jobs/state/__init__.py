"""What is known of vessels and of what is stored of them: out of date, withdrawn, renamed or removed."""
