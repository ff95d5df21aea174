"""How the guide is built: what runs a page's code, formulas beside the lines that they are, the reference."""
