//! Point clouds lifted from imprints, in the grasp frame.
