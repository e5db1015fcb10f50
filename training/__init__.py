"""Training of the shipped model bundles on simulated touches; see README.md in this folder."""
