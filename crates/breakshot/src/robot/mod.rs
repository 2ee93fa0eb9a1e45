//! How does the arm carry out the strike?
