"""The page of the brick panels' paper: every number that it prints beside ours, and what moves ours."""
