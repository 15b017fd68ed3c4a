//! Local names of bodies: a persistent linked list that grows at its front. A lambda shares the
//! part that existed before it.

use std::rc::Rc;

/// Local names visible to an expression with their values, the latest first.
#[derive(Clone, Debug)]
pub(crate) struct Scope<'a, V>(Option<Rc<Binding<'a, V>>>);

#[derive(Debug)]
struct Binding<'a, V> {
    /// Maximum depth of the values of this scope.
    depth: u32,
    name: &'a str,
    value: V,
    outer: Scope<'a, V>,
}

impl<V> Default for Scope<'_, V> {
    fn default() -> Self {
        Self(None)
    }
}

impl<'a, V: Clone> Scope<'a, V> {
    /// Returns this scope with one more name, whose value is nested to this depth.
    pub(crate) fn with(&self, name: &'a str, value: V, depth: u32) -> Self {
        let depth = self.depth().max(depth);
        let outer = self.clone();
        Self(Some(Rc::new(Binding {
            depth,
            name,
            value,
            outer,
        })))
    }
    /// Returns the maximum depth of the values of this scope.
    pub(crate) fn depth(&self) -> u32 {
        self.0.as_ref().map_or(0, |binding| binding.depth)
    }
    /// Returns the value of a name, the latest of that name.
    pub(crate) fn get(&self, name: &str) -> Option<&V> {
        let mut scope = self;
        while let Some(binding) = &scope.0 {
            if binding.name == name {
                return Some(&binding.value);
            }
            scope = &binding.outer;
        }
        None
    }
}

impl<V> Drop for Scope<'_, V> {
    /// Drops the list without recursion, since a body may define thousands of names.
    fn drop(&mut self) {
        let mut next = self.0.take();
        while let Some(binding) = next {
            next = match Rc::try_unwrap(binding) {
                Ok(mut only) => only.outer.0.take(),
                Err(_) => None,
            };
        }
    }
}
