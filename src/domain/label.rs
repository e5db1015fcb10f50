//! Editing contact masks: brush stamps, patches, clean-ups.
