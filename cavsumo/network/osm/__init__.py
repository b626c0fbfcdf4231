"""Networks from OpenStreetMap extracts: their roads, the side of traffic, SUMO's netconvert."""
