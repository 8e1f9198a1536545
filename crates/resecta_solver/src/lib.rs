//! Motion and resection of a mass-spring tissue filled with pentahedra.
