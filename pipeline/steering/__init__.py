"""What users do with parameters: Nomoto constants, stability, state space for a controller, a course-keeping law."""
