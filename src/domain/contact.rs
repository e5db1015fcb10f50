//! Contact masks from depth: threshold, top percent, CAD signed distance.
