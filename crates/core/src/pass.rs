/// A pass and the time it took; the same names on both backends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Milliseconds.
    pub ms: f64,
}

impl PassTime {
    /// Adds a time to the list; passes of one name are one row.
    pub fn add(list: &mut Vec<Self>, name: &'static str, ms: f64) {
        match list.iter_mut().find(|p| p.name == name) {
            Some(p) => p.ms += ms,
            None => list.push(Self { name, ms }),
        }
    }
}
