"""Several solvers on many problems at equal budgets: what they did, and the tables and profiles that tell it."""
