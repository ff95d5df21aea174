"""A frozen set of problems, as a file that others can run: see README.md beside this."""
