//! Colour maps for depth (sequential) and error (diverging); CPU twin of `shaders/common/color.wgsl`.
