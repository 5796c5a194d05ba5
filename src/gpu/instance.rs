//! The Vulkan loader, an instance of it, and the messenger through which the
//! validation layer speaks.

use std::borrow::Cow;
use std::ffi::{CStr, c_char, c_void};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;

use super::failed;
use crate::error::{Error, Result};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The newest version whose features are used, where the loader has it.
const NEWEST_VERSION: u32 = vk::API_VERSION_1_3;

/// Where a loader and a driver come from, for error messages.
const PACKAGES: &str = "install a Vulkan loader and driver \
     (Debian/Ubuntu: libvulkan1 and mesa-vulkan-drivers, or the GPU vendor's driver)";

/// What the validation layer reported, oldest first. Outlives its device, so
/// that what is reported while the device is destroyed can be read too.
#[derive(Debug, Default)]
pub struct ValidationLog(Mutex<Vec<String>>);

impl ValidationLog {
    /// Every error and warning so far.
    pub fn messages(&self) -> Vec<String> {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone()
    }

    fn push(&self, message: String) {
        self.0
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(message);
    }
}

/// An instance of the loader, with a messenger when validation is on.
pub(super) struct Instance {
    pub(super) raw: ash::Instance,
    /// The version that was asked for: the loader's, at most [`NEWEST_VERSION`].
    pub(super) version: u32,
    /// Whether objects can be named for debuggers and messages.
    pub(super) debug_utils: bool,
    pub(super) log: Arc<ValidationLog>,
    messenger: Option<(ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// The loaded library: dropped after `Drop::drop` has made the last call into it.
    entry: ash::Entry,
}

/// Holds the driver, and the layer where validation is on, in this process: the loader unloads them with the last
/// instance that needs them, and NVIDIA's driver (580.159, under validation) could not be loaded a 31st time. A process that
/// makes one instance pays nothing for this; with the second, one more is made and never destroyed.
fn keep_loaded(info: &vk::InstanceCreateInfo<'_>, validation: bool) {
    static STARTED: [AtomicUsize; 2] = [const { AtomicUsize::new(0) }; 2];
    if STARTED[usize::from(validation)].fetch_add(1, Ordering::Relaxed) != 1 {
        return;
    }
    // SAFETY: the loader that was found a moment ago, never unloaded from here on.
    if let Ok(entry) = unsafe { ash::Entry::load() } {
        // SAFETY: all pointers in `info` outlive the call.
        // Where it fails, all goes on as without it.
        let _ = unsafe { entry.create_instance(info, None) };
        std::mem::forget(entry);
    }
}

impl Instance {
    pub(super) fn new(validation: bool) -> Result<Self> {
        // SAFETY: the platform's Vulkan loader is trusted to be one; it stays loaded as long as `entry` lives.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| Error::Unsupported {
            what: String::from("Vulkan"),
            missing: format!("no loader was found ({error}); {PACKAGES}"),
        })?;
        #[cfg(feature = "faults")]
        let entry = super::shim::interpose(entry);
        let version = loader_version(&entry)?;
        let debug_utils = has_extension(
            // SAFETY: a global command without preconditions.
            &unsafe { entry.enumerate_instance_extension_properties(None) }
                .map_err(failed("list the extensions of Vulkan"))?,
            ash::ext::debug_utils::NAME,
        );
        if validation {
            require_validation(&entry)?;
        }

        let log = Arc::new(ValidationLog::default());
        #[cfg(feature = "faults")]
        super::shim::watch(&log);
        let application = vk::ApplicationInfo::default()
            .application_name(c"etendue")
            .engine_name(c"etendue")
            .api_version(version);
        let mut layers = Vec::new();
        let mut extensions = Vec::new();
        if debug_utils || validation {
            extensions.push(ash::ext::debug_utils::NAME.as_ptr());
        }
        let mut messenger_info = messenger_info(&log);
        let enables = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&enables);
        if validation {
            layers.push(VALIDATION_LAYER.as_ptr());
            extensions.push(ash::ext::validation_features::NAME.as_ptr());
        }
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        keep_loaded(&info, validation);
        if validation {
            // The messenger in the chain hears vkCreateInstance and vkDestroyInstance themselves.
            info = info.push_next(&mut messenger_info).push_next(&mut features);
        }
        // SAFETY: all pointers in `info` outlive the call; the messenger's user data outlives the instance.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => no_driver(),
            result => failed("create a Vulkan instance")(result),
        })?;
        let mut instance = Self {
            raw,
            version,
            debug_utils: debug_utils || validation,
            log,
            messenger: None,
            entry,
        };
        if validation {
            instance.listen()?;
        }
        Ok(instance)
    }

    /// All physical devices in the loader's order; an error when there is none.
    pub(super) fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() };
        match devices {
            Ok(devices) if !devices.is_empty() => Ok(devices),
            // What loaders say when a driver is installed but cannot start.
            Ok(_) | Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Err(no_driver()),
            Err(result) => Err(failed("list the Vulkan devices")(result)),
        }
    }

    fn listen(&mut self) -> Result<()> {
        let functions = ash::ext::debug_utils::Instance::new(&self.entry, &self.raw);
        // SAFETY: the user data is owned by `self.log`, which outlives the messenger.
        let messenger =
            unsafe { functions.create_debug_utils_messenger(&messenger_info(&self.log), None) }
                .map_err(failed("create a debug messenger"))?;
        self.messenger = Some((functions, messenger));
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((functions, messenger)) = self.messenger.take() {
            // SAFETY: created from this instance and used nowhere else.
            unsafe { functions.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: everything made from the instance was dropped by its owner, which held it.
        unsafe { self.raw.destroy_instance(None) };
    }
}

/// Whether `name` is among the extensions.
pub(super) fn has_extension(extensions: &[vk::ExtensionProperties], name: &CStr) -> bool {
    extensions
        .iter()
        .any(|e| e.extension_name_as_c_str() == Ok(name))
}

/// `1.3.239` of a packed version.
pub(super) fn version_parts(version: u32) -> (u32, u32, u32) {
    (
        vk::api_version_major(version),
        vk::api_version_minor(version),
        vk::api_version_patch(version),
    )
}

fn no_driver() -> Error {
    Error::Unsupported {
        what: String::from("Vulkan"),
        missing: format!("no driver offers a device; {PACKAGES}"),
    }
}

fn loader_version(entry: &ash::Entry) -> Result<u32> {
    // SAFETY: a global command without preconditions.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .map_err(failed("ask for the version of Vulkan"))?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_2 {
        let (major, minor, patch) = version_parts(version);
        return Err(Error::Unsupported {
            what: String::from("Vulkan"),
            missing: format!(
                "the loader has version {major}.{minor}.{patch}, 1.2 is needed; {PACKAGES}"
            ),
        });
    }
    Ok(version.min(NEWEST_VERSION))
}

fn require_validation(entry: &ash::Entry) -> Result<()> {
    // SAFETY: global commands without preconditions; the name is terminated.
    let extensions =
        unsafe { entry.enumerate_instance_extension_properties(Some(VALIDATION_LAYER)) };
    match extensions {
        Ok(list) if has_extension(&list, ash::ext::validation_features::NAME) => Ok(()),
        _ => Err(Error::Unsupported {
            what: String::from("Vulkan validation"),
            missing: String::from(
                "the layer VK_LAYER_KHRONOS_validation with VK_EXT_validation_features \
                 (Debian/Ubuntu: vulkan-validationlayers)",
            ),
        }),
    }
}

fn messenger_info(log: &Arc<ValidationLog>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::{
        DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type,
    };
    // GENERAL is left out: there the loader speaks of drivers that are no concern of ours.
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(on_message))
        .user_data(Arc::as_ptr(log).cast_mut().cast())
}

/// Called by the validation layer, on the thread whose call it judges.
unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid, terminated strings (or null) for the time of the call.
    let text = unsafe {
        data.as_ref().map_or_else(
            || String::from("(no text)"),
            |d| with_rule(&lossy(d.p_message_id_name), &lossy(d.p_message)),
        )
    };
    if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
        tracing::error!(target: "vulkan", "{text}");
    } else {
        tracing::warn!(target: "vulkan", "{text}");
    }
    // SAFETY: `user_data` is the log that `Instance` owns for longer than the messenger lives.
    if let Some(log) = unsafe { user_data.cast::<ValidationLog>().as_ref() } {
        log.push(text);
    }
    // The call that is judged goes on.
    vk::FALSE
}

/// The text of a string of the layer; empty when there is none.
///
/// # Safety
///
/// `string` is null, or terminated and unchanged while the result lives.
unsafe fn lossy<'a>(string: *const c_char) -> Cow<'a, str> {
    if string.is_null() {
        return Cow::Borrowed("");
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(string) }.to_string_lossy()
}

/// A message with the name of the rule that was broken. Older layers (1.3.239) repeat it
/// in every text; newer ones (1.4.309) leave it out of some.
fn with_rule(rule: &str, text: &str) -> String {
    if text.contains(rule) {
        text.to_owned()
    } else {
        format!("{rule}: {text}")
    }
}
