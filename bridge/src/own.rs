//! Files and folders that only this user may access. A symbolic link inside such a folder is never
//! followed, so only this user can hold a lock on such a file.

use std::fs::{self, DirBuilder, File, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::Path;

/// Creates the folder of all state, if missing. Only here a link is allowed: the user chose it.
pub(crate) fn root(folder: &Path) -> io::Result<()> {
    builder().create(folder)?;
    check(&fs::canonicalize(folder)?, true)
}

pub(crate) fn folder(folder: &Path) -> io::Result<()> {
    builder().create(folder)?;
    check(folder, true)
}

/// Restricts a file inside the root to this user; a missing file is fine.
pub(crate) fn mend(path: &Path) -> io::Result<()> {
    match check(path, false) {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// Opens a file inside the root with `options`, which may create it.
pub(crate) fn open(path: &Path, options: &mut OpenOptions) -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        let no_link = i32::try_from(rustix::fs::OFlags::NOFOLLOW.bits()).unwrap_or_default();
        options.mode(0o600).custom_flags(no_link);
    }
    let file = options.open(path)?;
    check(path, false)?;
    Ok(file)
}

fn builder() -> DirBuilder {
    let mut builder = DirBuilder::new();
    builder.recursive(true);
    #[cfg(unix)]
    std::os::unix::fs::DirBuilderExt::mode(&mut builder, 0o700);
    builder
}

/// Checks type and owner of `path`, and removes the rights of others.
fn check(path: &Path, is_folder: bool) -> io::Result<()> {
    let found = fs::symlink_metadata(path)?;
    let refuse = |why: &str| Err(io::Error::new(ErrorKind::PermissionDenied, why.to_owned()));
    if found.is_symlink() {
        return refuse("it is a symbolic link");
    }
    if is_folder != found.is_dir() || !(is_folder || found.is_file()) {
        return refuse(if is_folder { "it is no folder" } else { "it is no ordinary file" });
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, PermissionsExt};
        if found.uid() != rustix::process::geteuid().as_raw() {
            return refuse("it belongs to another user");
        }
        let wanted = if is_folder { 0o700 } else { 0o600 };
        if found.permissions().mode() & 0o077 != 0 {
            fs::set_permissions(path, fs::Permissions::from_mode(wanted))?;
        }
    }
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).unwrap().permissions().mode() & 0o777
    }

    #[test]
    fn files_are_private_and_links_are_not_followed() {
        let place = tempfile::tempdir().unwrap();
        let home = place.path().join("home");
        fs::create_dir(&home).unwrap();
        fs::set_permissions(&home, fs::Permissions::from_mode(0o755)).unwrap();
        let link = place.path().join("link");
        symlink(&home, &link).unwrap();
        root(&link).unwrap();
        assert_eq!(mode(&home), 0o700, "the root may be reached through a link");
        folder(&home.join("jobs")).unwrap();
        assert_eq!(mode(&home.join("jobs")), 0o700);
        let file = home.join("record");
        drop(open(&file, OpenOptions::new().create(true).append(true)).unwrap());
        assert_eq!(mode(&file), 0o600);
        fs::set_permissions(&file, fs::Permissions::from_mode(0o666)).unwrap();
        mend(&file).unwrap();
        assert_eq!(mode(&file), 0o600);
        mend(&home.join("nothing")).unwrap();

        let precious = place.path().join("precious");
        fs::write(&precious, b"mine").unwrap();
        symlink(&precious, home.join("journal")).unwrap();
        symlink(place.path(), home.join("elsewhere")).unwrap();
        assert!(mend(&home.join("journal")).is_err());
        assert!(open(&home.join("journal"), OpenOptions::new().write(true).truncate(true)).is_err());
        assert!(folder(&home.join("elsewhere")).is_err());
        assert!(open(&home.join("jobs"), OpenOptions::new().read(true)).is_err(), "a folder is no file");
        assert_eq!(fs::read(&precious).unwrap(), b"mine");
    }
}
