"""Pictures of energy levels: term diagrams, levels in fields, torsion, heat capacities."""
