// Computes CRC-32C over the firmware's sources and those of the link, in the firmware's folder `base`. The
// build scripts of the firmware, which reports it, and of the drill, which compares it, include this file.

fn firmware_sources(base: &std::path::Path) -> u32 {
    fn look(base: &std::path::Path, folder: &str, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(base.join(folder)).into_iter().flatten().flatten() {
            let name = format!("{folder}/{}", entry.file_name().to_string_lossy());
            if entry.path().is_dir() { look(base, &name, found) } else { found.push(name) }
        }
    }
    let mut found = vec!["Cargo.lock".to_owned(), "memory.x".to_owned()];
    look(base, "src", &mut found);
    look(base, "../../link/src", &mut found);
    found.sort();
    let read = |name: &String| {
        let path = base.join(name);
        println!("cargo:rerun-if-changed={}", path.display());
        std::fs::read(path).unwrap_or_default()
    };
    annulus_link::crc::crc32c(&found.iter().flat_map(read).collect::<Vec<u8>>())
}
