//! What figures were measured on.

use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// The processor's model name.
pub fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find_map(|l| l.strip_prefix("model name")?.split_once(':'));
    model.map_or_else(|| std::env::consts::ARCH.to_owned(), |m| m.1.trim().to_owned())
}

/// The commit of the source, if it is in a repository; `-dirty` stands behind it where files are not as in
/// that commit, those of the documents aside: a run that goes on record changes them.
pub fn commit() -> Option<String> {
    commit_of(Path::new(env!("CARGO_MANIFEST_DIR")))
}

fn commit_of(folder: &Path) -> Option<String> {
    let git = |arguments: &[&str]| Command::new("git").arg("-C").arg(folder).args(arguments).output().ok();
    let head = git(&["rev-parse", "--short", "HEAD"]).filter(|out| out.status.success())?;
    let is_clean = git(&["diff", "--quiet", "HEAD", "--", ":/", ":(top,exclude)docs"])?.status.success();
    Some(String::from_utf8_lossy(&head.stdout).trim().to_owned() + if is_clean { "" } else { "-dirty" })
}

/// Today, UTC.
pub fn today() -> String {
    date(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs()))
}

/// The day of a time since 1970, UTC (days to civil date after Hinnant).
fn date(seconds: u64) -> String {
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year_of_era = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let (day, month) = (day_of_year - (153 * shifted + 2) / 5 + 1, if shifted < 10 { shifted + 3 } else { shifted - 9 });
    format!("{:04}-{month:02}-{day:02}", year_of_era + era * 400 + u64::from(month <= 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Figures of source that is in no commit do not pass for that of the last one.
    #[test]
    fn changed_source_is_told_from_its_commit() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |file: &str, text: &str| std::fs::write(folder.path().join(file), text).expect("written");
        let git = |arguments: &[&str]| {
            let who = ["-c", "user.name=n", "-c", "user.email=e", "-c", "commit.gpgsign=false"];
            let status = Command::new("git").arg("-C").arg(folder.path()).args(who).args(arguments).status().expect("git");
            assert!(status.success(), "{arguments:?}");
        };
        assert_eq!(commit_of(folder.path()), None);
        std::fs::create_dir_all(folder.path().join("docs")).expect("a folder");
        ["source", "docs/record"].into_iter().for_each(|file| write(file, "old"));
        git(&["init", "--quiet"]);
        git(&["add", "."]);
        git(&["commit", "--quiet", "--message", "m"]);
        let clean = commit_of(folder.path()).expect("a commit");
        assert!(clean.len() >= 7 && clean.chars().all(|c| c.is_ascii_hexdigit()), "{clean}");
        write("docs/record", "new");
        assert_eq!(commit_of(&folder.path().join("docs")), Some(clean.clone()));
        write("source", "new");
        assert_eq!(commit_of(&folder.path().join("docs")), Some(clean + "-dirty"));
    }

    #[test]
    fn dates_are_civil() {
        assert_eq!(date(0), "1970-01-01");
        assert_eq!(date(951_782_400), "2000-02-29");
        assert_eq!(date(1_798_761_599), "2026-12-31");
        assert_eq!(date(1_798_761_600), "2027-01-01");
    }
}
