"""What a run survives: too long for every test run, each a function that returns figures."""
