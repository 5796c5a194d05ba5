//! Renders whose pixels take different numbers of samples.

use super::{Control, Renderer, Team};
use crate::error::{Error, Result};
use crate::film::{Allotment, Budget, Film};

impl Renderer {
    /// Gives each pixel of the window its number of samples from here on; an empty allotment gives all the same.
    ///
    /// # Errors
    /// [`Error::Settings`] where the settings do not say [`crate::settings::Settings::adaptive`], it is one of another window, or
    /// an exponent is above [`Allotment::MOST`]; or the device fails.
    pub fn allot(&mut self, allotment: &Allotment) -> Result<()> {
        let pixels = self.empty_film().pixels();
        let given = allotment.exponents();
        let fail = |what: String| {
            let name = "--adaptive";
            Err(Error::Settings { name, what })
        };
        if !self.settings.adaptive {
            return fail(String::from("the kernel gives all pixels as many samples"));
        }
        if !given.is_empty() && given.len() != pixels {
            return fail(format!("{} numbers for {pixels} pixels", given.len()));
        }
        if allotment.most() > u32::from(Allotment::MOST) {
            return fail(format!("2^{} samples at once", allotment.most()));
        }
        let exponents: Vec<u32> = (0..pixels).map(|p| allotment.exponent(p)).collect();
        self.backend.set_allotment(&exponents)?;
        self.allotment = allotment.clone();
        Ok(())
    }

    /// Spreads `samples` a pixel on average over the pixels by a pilot; returns how many those take that take the fewest, which
    /// are the samples to render then. Too few to spread are left as they are.
    ///
    /// # Errors
    /// As [`Self::allot`].
    pub fn spread(&mut self, samples: u64) -> Result<u64> {
        self.allot(&Allotment::default())?;
        let Some(budget) = Budget::of(samples) else {
            return Ok(samples);
        };
        let (range, seed) = (self.settings.samples.clone(), self.settings.seed);
        self.restart(0..budget.pilot, self.settings.pilot().seed)?;
        let pilot = self.render(&mut |_| Control::Continue)?;
        self.restart(range, seed)?;
        self.allot(&Allotment::of(&pilot, samples, budget))?;
        Ok(budget.least)
    }

    /// What a render of these settings begins with.
    pub(super) fn empty_film(&self) -> Film {
        Film::of(&self.settings).with_allotment(self.allotment.clone())
    }
}

impl Team {
    /// As [`Renderer::allot`], on every device.
    ///
    /// # Errors
    /// As [`Renderer::allot`].
    pub fn allot(&mut self, allotment: &Allotment) -> Result<()> {
        for member in &mut self.members {
            member.allot(allotment)?;
        }
        self.allotment = allotment.clone();
        Ok(())
    }
}
