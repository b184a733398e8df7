"""What peers can ask of components, their execution contexts and their manager."""
