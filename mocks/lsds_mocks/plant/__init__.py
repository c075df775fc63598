"""Physics of the cell: object on a table, two-finger grip, friction, arm and finger motion. SI units, z upward."""
