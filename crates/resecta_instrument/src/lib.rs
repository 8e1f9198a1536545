//! The resectoscope: kinematics, loop, pedals and where its input comes from.
