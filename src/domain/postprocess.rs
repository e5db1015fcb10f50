//! From the decoder's output to an imprint in metres.
