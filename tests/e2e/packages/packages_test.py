#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Packages as a stranger has them: built by scripts/package, installed into a Debian that has nothing else, and used there without a
compiler; and the image of packaging/Containerfile, where buildah is installed.

usage: packages_test.py SOURCE
ECORCHE_PACKAGES names a folder of packages that are built already, ECORCHE_DEBIAN a bare Debian (of debootstrap) that is copied.
"""
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE = pathlib.Path(sys.argv[1])
HERE = pathlib.Path(__file__).resolve().parent
# What Debian's slim images leave out of whatever is installed in them.
SLIM = ("".join(f"path-exclude=/usr/share/{folder}/*\n" for folder in ("doc", "info", "linda", "lintian/overrides", "locale", "man"))
        + "path-include=/usr/share/doc/*/copyright\n")
BUILD_ECORCHE = SOURCE / "build" / "release" / "bin" / "ecorche"


def run(*words, **options):
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)
    assert done.returncode == 0, f"{words}: {done.returncode}\n{done.stdout[-6000:]}"
    return done.stdout


def mirror():
    """Where this machine's apt finds Debian: the first place that its own configuration names."""
    said = run("apt-get", "indextargets", "--format", "$(REPO_URI)", "Created-By: Packages").split()
    assert said, "apt knows no place for packages"
    return said[0]


def compiled_before():
    """A container's RUN finds there what was compiled here: the same sources are compiled in minutes less."""
    if not shutil.which("ccache"):
        return ()
    cache = pathlib.Path(run("ccache", "--get-config", "cache_dir").strip())
    return ("--volume", f"{cache}:/root/.cache/ccache") if cache.is_dir() else ()


def bare_debian(folder):
    tree = folder / "debian"
    if "ECORCHE_DEBIAN" in os.environ:
        run("cp", "-a", os.environ["ECORCHE_DEBIAN"], tree)
    else:
        run("debootstrap", "--variant=minbase", "bookworm", tree, mirror())
    # It asks whom this machine asks, in the same way.
    for name in ("sources.list", "sources.list.d", "apt.conf.d", "keyrings", "trusted.gpg.d", "auth.conf.d"):
        here, there = pathlib.Path("/etc/apt", name), tree / "etc" / "apt" / name
        if there.is_dir():
            shutil.rmtree(there)
        elif there.exists():
            there.unlink()
        if here.is_dir():
            shutil.copytree(here, there)
        elif here.exists():
            shutil.copy(here, there)
    for name in ("etc/resolv.conf", "etc/hosts"):
        shutil.copy(pathlib.Path("/", name), tree / name)
    # Likewise what npm asks for the viewer's packages, and authorities that are this machine's own.
    authorities = pathlib.Path("usr/local/share/ca-certificates")
    if pathlib.Path("/", authorities).is_dir():
        shutil.copytree(pathlib.Path("/", authorities), tree / authorities, dirs_exist_ok=True)
    if shutil.which("npm"):
        registry = run("npm", "config", "get", "registry", cwd="/").strip()
        (tree / "root" / ".npmrc").write_text(f"registry={registry}\ncafile=/etc/ssl/certs/ca-certificates.crt\n")
    # Who loses power has lost this tree anyway.
    (tree / "etc" / "dpkg" / "dpkg.cfg.d" / "unsafe").write_text("force-unsafe-io\n")
    # No service is started for being installed.
    (tree / "usr" / "sbin" / "policy-rc.d").write_text("#!/bin/sh\nexit 101\n")
    (tree / "usr" / "sbin" / "policy-rc.d").chmod(0o755)
    return tree


@unittest.skipUnless(os.geteuid() == 0, "it asks for root")
class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.scratch.cleanup)
        folder = pathlib.Path(cls.scratch.name)
        begin = time.monotonic()
        cls.built = pathlib.Path(os.environ.get("ECORCHE_PACKAGES", folder / "packages"))
        if "ECORCHE_PACKAGES" not in os.environ:
            run(SOURCE / "scripts" / "package", "--out", cls.built)
        cls.debs = {path.name.split("_")[0]: path for path in cls.built.glob("*.deb")}
        packed = time.monotonic()
        cls.tree = bare_debian(folder)
        print(f"packages in {packed - begin:.0f} s, a bare Debian in {time.monotonic() - packed:.0f} s", file=sys.stderr)

    def inside(self, *words):
        """A command in that Debian, with processes of its own: none outlives it."""
        return run("unshare", "--mount", "--pid", "--fork", "--kill-child", f"--mount-proc={self.tree / 'proc'}", "chroot", self.tree, *words,
                   env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C.UTF-8", "DEBIAN_FRONTEND": "noninteractive", "HOME": "/root"})

    def test_1_what_is_in_them(self):
        self.assertEqual(len(self.debs), 5, self.debs)
        library = next(name for name in self.debs if re.fullmatch(r"libecorche\d+", name))
        files = {name: {line.split()[-1].removeprefix(".") for line in run("dpkg-deb", "-c", path).splitlines() if not line.startswith("d") and " -> " not in line}
                 for name, path in self.debs.items()}
        for name in self.debs:
            for paper in ("copyright", "changelog.gz", "changelog.Debian.gz"):
                self.assertIn(f"/usr/share/doc/{name}/{paper}", files[name])
        for path in ("/usr/bin/ecorche", "/usr/share/man/man1/ecorche-serve.1.gz", "/usr/lib/systemd/system/ecorche.service",
                     "/usr/lib/systemd/system/ecorche.socket", "/usr/share/bash-completion/completions/ecorche",
                     "/usr/share/zsh/vendor-completions/_ecorche", "/usr/share/fish/vendor_completions.d/ecorche.fish"):
            self.assertIn(path, files["ecorche"])
        self.assertEqual({path.split("/")[3] for path in files[library]} - {"doc", "lintian"}, {run("dpkg-architecture", "-qDEB_HOST_MULTIARCH").strip()})
        self.assertIn("/usr/include/ecorche/ecorche.h", files["libecorche-dev"])
        self.assertIn("/usr/lib/python3/dist-packages/ecorche/__init__.py", files["python3-ecorche"])
        self.assertIn("/usr/share/doc/ecorche-doc/html/index.html", files["ecorche-doc"])
        both = [path for path in set().union(*files.values()) if sum(path in of for of in files.values()) > 1]
        self.assertEqual(both, [], "a file of two packages")

    def test_2_what_they_ask_for(self):
        def field(name, key):
            return run("dpkg-deb", "-f", self.debs[name], key).strip()
        library = next(name for name in self.debs if re.fullmatch(r"libecorche\d+", name))
        self.assertRegex(field("ecorche", "Depends"), r"libc6 \(>= .*libvtk9\.1.*libyaml-cpp")
        self.assertNotRegex(field(library, "Depends"), r"vtk|insight|cgal|gmp|suitesparse|cholmod|tet1")
        for name in ("libecorche-dev", "python3-ecorche"):
            self.assertIn(f"{library} (= {field('ecorche', 'Version')})", field(name, "Depends"))
        self.assertEqual({field(name, "Architecture") for name in ("ecorche-doc", "python3-ecorche")}, {"all"})

    @unittest.skipUnless(shutil.which("buildah"), "no buildah (scripts/setup --all)")
    def test_3_the_container_is_healthy(self):
        """packaging/Containerfile, both stages as from a cold clone, on that Debian before anything is installed there, which takes the
        place of Debian's image."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            buildah = ("buildah", "--root", folder / "store", "--runroot", folder / "run")
            base = run(*buildah, "from", "scratch").split()[-1]
            (folder / "slim").write_text(SLIM)
            run(*buildah, "add", "--quiet", base, self.tree, "/")
            run(*buildah, "add", "--quiet", base, folder / "slim", "/etc/dpkg/dpkg.cfg.d/")
            run(*buildah, "commit", "--quiet", "--rm", base, "localhost/debian")
            begin = time.monotonic()
            built = run(*buildah, "bud", "--isolation", "chroot", "--network", "host", "--format", "docker", "--pull=false", *compiled_before(),
                        "--build-arg", "BASE=localhost/debian", "--tag", "localhost/ecorche", "--file", SOURCE / "packaging" / "Containerfile", SOURCE)
            print(f"image built in {time.monotonic() - begin:.0f} s", file=sys.stderr)
            self.assertIn("[1/2] STEP", built)
            self.assertIn("lintian: ", built)
            config = json.loads(run(*buildah, "inspect", "--type", "image", "localhost/ecorche"))["Docker"]["config"]
            self.assertEqual((config["User"], config["Healthcheck"]["Test"]), ("7070:7070", ["CMD", "healthy"]))
            run(BUILD_ECORCHE, "phantom", "-o", folder / "patient", "--size", "small")
            (folder / "models").mkdir()
            run(BUILD_ECORCHE, "preprocess", folder / "patient", "-o", folder / "models" / "patient.hdf", "--max-tets", "50000")
            for path in (folder, folder / "models", folder / "models" / "patient.hdf"):
                path.chmod(0o755)
            container = run(*buildah, "from", "--pull=false", "localhost/ecorche").split()[-1]
            inside = (*buildah, "run", "--isolation", "chroot", "--volume", f"{folder / 'models'}:/models:ro", container, "--")
            # In a network of its own, and with processes that end with the first.
            said = run("unshare", "--net", "--pid", "--mount-proc", "--fork", "--kill-child", "sh", HERE / "contained.sh", *config["Entrypoint"], "--insecure",
                       "/models/patient.hdf", env={**os.environ, "INSIDE": shlex.join(map(str, inside))})
            self.assertIn("uid=7070 gid=7070", said)
            self.assertIn("sick before, healthy then, no compiler, a viewer", said)

    def test_4_from_nothing_to_a_served_body(self):
        (self.tree / "packages").mkdir()
        for path in self.debs.values():
            shutil.copy(path, self.tree / "packages")
        shutil.copy(HERE / "served.sh", self.tree / "served.sh")
        begin = time.monotonic()
        self.inside("apt-get", "update", "-q")
        self.inside("sh", "-c", "apt-get install -q -y --no-install-recommends /packages/*.deb")
        installed = time.monotonic()
        said = self.inside("sh", "/served.sh")
        served = time.monotonic()
        print(f"installed in {installed - begin:.0f} s, posed by a server {served - installed:.1f} s later", file=sys.stderr)
        self.assertLess(served - installed, 60)
        self.assertRegex(said, r"posed in process: \d+ vertices")
        self.assertRegex(said, r"posed by the server: \(\d+, 3\)")
        self.assertEqual(self.inside("ldconfig", "-p").count("\tlibecorche"), 4, "two libraries, by their names at run time and at link time")
        self.inside("dpkg", "--purge", *self.debs)
        left = run("find", self.tree / "usr", self.tree / "etc", self.tree / "lib", self.tree / "var/lib", "-iname", "*ecorche*")
        self.assertEqual(left, "", "what is purged is gone")

    @unittest.skipUnless(shutil.which("systemd-nspawn"), "no systemd-nspawn (scripts/setup --all)")
    def test_5_a_service_of_systemd(self):
        """By systemd itself, which starts in that Debian: with all that the unit forbids."""
        self.inside("sh", "-c", "apt-get install -q -y --no-install-recommends systemd systemd-sysv dbus iproute2 /packages/ecorche_*.deb "
                    "/packages/libecorche[0-9]*.deb /packages/python3-ecorche_*.deb")
        shutil.copy(HERE / "under_systemd.sh", self.tree)
        self.inside("sh", "-c", "cd /tmp && ecorche phantom -o body --size small && ecorche preprocess body -o body.hdf --max-tets 50000 && "
                    "install -D -m 644 body.hdf /srv/ecorche/patient.hdf")
        # The cgroups that the machine has, whichever they are.
        hierarchy = "1" if pathlib.Path("/sys/fs/cgroup/cgroup.controllers").exists() else "0"
        with subprocess.Popen(["systemd-nspawn", "--quiet", "--directory", self.tree, "--private-network", "--register=no", "--keep-unit", "--boot"],
                              env={**os.environ, "SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": hierarchy}, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.STDOUT) as machine:
            try:
                children = pathlib.Path(f"/proc/{machine.pid}/task/{machine.pid}/children")
                until = time.monotonic() + 60
                while not (first := children.read_text().split()):
                    self.assertLess(time.monotonic(), until, "systemd does not start")
                    time.sleep(0.1)
                said = run("nsenter", "--target", first[0], "--mount", "--pid", "--net", "--uts", "--ipc", "--root", "--wd", "sh", "/under_systemd.sh",
                           env={"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LC_ALL": "C.UTF-8"}, timeout=300)
            finally:
                machine.terminate()
        self.assertIn("all is well", said)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
