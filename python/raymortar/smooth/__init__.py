"""Round bodies of straight facets: `curving`, arcs in their place."""
