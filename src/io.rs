//! Adapters to files: datasets, meshes, arrays, masks, export.
