"""Pictures that tables look at: takes of the physical rooms, and how methods play them."""
