pub fn speed() {}
