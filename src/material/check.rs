//! Laws that every material must obey, one function per continuum.
