//! Programs in other controllers' words.
