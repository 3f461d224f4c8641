//! Runs that once had the tool over a plant that the beam had seen, each with the very lines and rolls that showed it.
