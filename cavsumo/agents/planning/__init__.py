"""From traffic to a game: a tester and the ego in relative coordinates, on a finite lattice."""
