"""Running studies: one by one, in processes or on a cluster."""
