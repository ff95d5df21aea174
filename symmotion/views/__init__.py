"""Pictures of motions and solutions, notebook display and films; Matplotlib is loaded by who draws."""
