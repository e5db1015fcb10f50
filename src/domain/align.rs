//! Registration: contact points to the in-hand pose.
