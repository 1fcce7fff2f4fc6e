"""A data set from a mesh: scene, plan, frames."""
