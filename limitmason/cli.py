"""The command line: experiments, solve, figure."""
