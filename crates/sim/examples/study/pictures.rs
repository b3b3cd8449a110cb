pub fn draw(_write: crate::Write) {}
