//! A station with a controller that is played.
