//! Ladders that go on under failed input channels.
