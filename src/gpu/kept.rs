//! Pipelines that a device keeps for those who ask for the same again.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::pipeline::{BindingKind, Pipeline, PipelineDesc};
use super::rays::RayStages;
use crate::error::Result;

/// So many: under validation on lavapipe each takes ten megabytes.
const MOST: usize = 12;

/// Everything that a pipeline is made of; what mostly differs, first.
#[derive(PartialEq, Eq)]
pub(super) struct Recipe {
    constants: Vec<(u32, u32)>,
    name: String,
    bindings: Vec<(u32, BindingKind)>,
    push_bytes: u32,
    modules: Vec<Vec<u32>>,
}

impl Recipe {
    pub fn new(desc: &PipelineDesc<'_>, stages: Option<&RayStages<'_>>) -> Self {
        let mut modules = vec![desc.spirv.to_vec()];
        if let Some(stages) = stages {
            modules.extend([stages.miss.to_vec(), stages.closest_hit.to_vec()]);
            let optional = [stages.any_hit, stages.intersection];
            modules.extend(optional.map(|spirv| spirv.unwrap_or_default().to_vec()));
        }
        Self {
            constants: desc.constants.to_vec(),
            name: desc.name.to_owned(),
            bindings: desc.bindings.to_vec(),
            push_bytes: desc.push_bytes,
            modules,
        }
    }
}

/// Those that were asked for last, last.
type Pipelines = Vec<(Recipe, Pipeline)>;

/// The pipelines of a device that keeps them. They hold the device, so it lives until they are let go.
#[derive(Default)]
pub(super) struct Kept(Mutex<Option<Pipelines>>);

impl Kept {
    fn lock(&self) -> MutexGuard<'_, Option<Pipelines>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps what is made from here on.
    pub fn begin(&self) {
        self.lock().get_or_insert_with(Vec::new);
    }

    /// Lets go of all, and keeps nothing more.
    pub fn end(&self) {
        let pipelines = self.lock().take();
        drop(pipelines);
    }

    /// The pipeline of this recipe, made where there is none.
    pub fn take_or(
        &self,
        recipe: impl FnOnce() -> Recipe,
        make: impl FnOnce() -> Result<Pipeline>,
    ) -> Result<Pipeline> {
        if self.lock().is_none() {
            return make();
        }
        let recipe = recipe();
        if let Some(pipelines) = self.lock().as_mut() {
            if let Some(at) = pipelines.iter().position(|(r, _)| *r == recipe) {
                let found = pipelines.remove(at);
                let pipeline = found.1.clone();
                pipelines.push(found);
                return Ok(pipeline);
            }
        }
        // Not under the lock: compilation takes seconds.
        let pipeline = make()?;
        let mut oldest = None;
        if let Some(pipelines) = self.lock().as_mut() {
            if pipelines.len() >= MOST {
                oldest = Some(pipelines.remove(0));
            }
            pipelines.push((recipe, pipeline.clone()));
        }
        drop(oldest);
        Ok(pipeline)
    }
}
