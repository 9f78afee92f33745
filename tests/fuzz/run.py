"""Runs one libFuzzer target for some seconds: TARGET CORPUS WORK_FOLDER SECONDS.

The committed corpus is read and never written; new inputs and findings go to the work folder. On a
finding the input's path is the last line. A dictionary beside this file, NAME.dict for the corpus
NAME, is used."""
import pathlib
import subprocess
import sys


def main(target, corpus, work, seconds):
    found = pathlib.Path(work) / "new"
    found.mkdir(parents=True, exist_ok=True)
    command = [target, f"-max_total_time={seconds}", "-timeout=30", "-rss_limit_mb=4096",
               "-max_len=16384", f"-artifact_prefix={work}/", "-print_final_stats=1",
               # Its own for a finding is 77, which meson reads as "skipped".
               "-error_exitcode=1",
               str(found), corpus]
    dictionary = pathlib.Path(__file__).with_name(pathlib.Path(corpus).name + ".dict")
    if dictionary.exists():
        command.append(f"-dict={dictionary}")
    return subprocess.run(command).returncode


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:5]))
