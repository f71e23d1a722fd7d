# SPDX-License-Identifier: Apache-2.0
"""Pages of the protocol's messages, made from proto/ecorche/v1 and its comments: {path under docs/reference: text}."""
import pathlib
import re
import subprocess
import tempfile

from google.protobuf import descriptor_pb2

from documentation.pages import ROOT, slug

FOLDER = ROOT / "proto"
ORDER = ["hello", "model", "stream", "command", "inspect", "record", "common"]
TITLES = {"hello": "Connection messages", "model": "Model messages", "stream": "Stream messages", "command": "Command messages", "inspect": "Looking messages",
          "record": "Recording messages", "common": "Shared messages"}
TYPES = descriptor_pb2.FieldDescriptorProto
NOTICE = "<!-- SPDX-License-Identifier: Apache-2.0 -->\n<!-- Made by scripts/reference from proto/ecorche/v1. Edit those files, then run it again. -->\n"
# Tags of FileDescriptorProto, DescriptorProto and EnumDescriptorProto in a location's path.
MESSAGE, ENUM, FIELD, NESTED, NESTED_ENUM, VALUE = 4, 5, 2, 3, 4, 2


class File:
    def __init__(self, descriptor):
        self.descriptor = descriptor
        self.name = pathlib.Path(descriptor.name).stem
        self.comments = {tuple(place.path): place.leading_comments or place.trailing_comments for place in descriptor.source_code_info.location}

    def comment(self, path, paragraphs=False):
        text = "\n".join(line.strip() for line in self.comments.get(tuple(path), "").splitlines())
        parts = [" ".join(part.split()) for part in re.split(r"\n\s*\n", text.strip())]
        return ("\n\n" if paragraphs else " ").join(in_markdown(part) for part in parts)

    def messages(self):
        """(path, full name, descriptor), nested ones after the one that holds them; and enums likewise."""
        def walk(path, prefix, message):
            yield [*path], prefix + message.name, message
            for i, nested in enumerate(message.nested_type):
                yield from walk([*path, NESTED, i], f"{prefix}{message.name}.", nested)
        for i, message in enumerate(self.descriptor.message_type):
            yield from walk([MESSAGE, i], "", message)

    def enums(self):
        for i, enum in enumerate(self.descriptor.enum_type):
            yield [ENUM, i], enum.name, enum
        for path, name, message in self.messages():
            for i, enum in enumerate(message.enum_type):
                yield [*path, NESTED_ENUM, i], f"{name}.{enum.name}", enum


def in_markdown(text):
    text = text.replace("&", "&amp;").replace("<", "&lt;").replace("|", "\\|")
    text = re.sub(r'docs/reference/(\w[\w-]*)\.md, "([^"]+)"', lambda m: f"[{m[2]}](../{m[1]}.md#{slug(m[2])})", text)
    text = re.sub(r"docs/reference/(\w[\w-]*)\.md", r"[\1](../\1.md)", text)
    return re.sub(r"(?<![\w`/.])((?:[A-Z][a-z]+\w*\.)+[a-z_]\w*|[A-Z]+(?:_[A-Z0-9]+)+)(?![\w`])", r"`\1`", text)


def read_files():
    with tempfile.TemporaryDirectory() as scratch:
        out = pathlib.Path(scratch) / "set"
        subprocess.run(["protoc", f"-I{FOLDER}", f"--descriptor_set_out={out}", "--include_source_info", *sorted(FOLDER.glob("ecorche/v1/*.proto"))],
                       check=True)
        everything = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes())
    return {pathlib.Path(file.name).stem: File(file) for file in everything.file}


def pages():
    files = read_files()
    home = {f"{file.descriptor.package}.{name}": file.name
            for file in files.values() for _, name, _ in [*file.messages(), *file.enums()]}
    out = {f"messages/{name}.md": page_of(files[name], home) for name in ORDER}
    out["messages/index.md"] = index_of(files, home)
    return out


def link(full, home, here):
    name = full.lstrip(".").removeprefix("ecorche.v1.")
    page = home["ecorche.v1." + name]
    return f"[{name}]({'' if page == here else page + '.md'}#{slug(name)})"


def type_of(field, home, here):
    if field.type in (TYPES.TYPE_MESSAGE, TYPES.TYPE_ENUM):
        name = link(field.type_name, home, here)
    else:
        name = TYPES.Type.Name(field.type).removeprefix("TYPE_").lower()
    return ("repeated " if field.label == TYPES.LABEL_REPEATED else "") + name


def page_of(file, home):
    first = re.match(r"// SPDX.*\n// (.*)", (FOLDER / "ecorche" / "v1" / f"{file.name}.proto").read_text())
    out = [NOTICE, f"# {TITLES[file.name]}\n", f"{in_markdown(first[1])} From `proto/ecorche/v1/{file.name}.proto`; the rules of the road are in "
           "[Protocol](../protocol.md).\n"]
    for path, name, message in file.messages():
        out.append(f"## {name}\n")
        if file.comment(path):
            out.append(file.comment(path, paragraphs=True) + "\n")
        if not message.field:
            out.append("No fields.\n")
            continue
        out.append("| field | type | meaning |\n|---|---|---|")
        for i, field in enumerate(message.field):
            meaning = file.comment([*path, FIELD, i])
            if field.HasField("oneof_index") and not field.proto3_optional:
                among = message.oneof_decl[field.oneof_index].name
                meaning = f"One of `{among}`. {meaning}".strip()
            out.append(f"| `{field.name}` = {field.number} | {type_of(field, home, file.name)} | {meaning} |")
        out.append("")
    for path, name, enum in file.enums():
        out.append(f"## {name}\n")
        if file.comment(path):
            out.append(file.comment(path, paragraphs=True) + "\n")
        out.append("| value | meaning |\n|---|---|")
        for i, value in enumerate(enum.value):
            out.append(f"| `{value.name}` = {value.number} | {file.comment([*path, VALUE, i])} |")
        out.append("")
    return "\n".join(out)


def index_of(files, home):
    """The envelope: every message, by who sends it."""
    file = files["envelope"]
    message = file.descriptor.message_type[0]
    out = [NOTICE, "# Messages\n",
           "One message travels on the wire, `ecorche.v1.Envelope` (`proto/ecorche/v1/envelope.proto`), with exactly one of the members "
           "below. How it is framed, and what may follow what, is in [Protocol](../protocol.md).\n",
           "Space is the patient's LPS, lengths are millimetres, angles radians, quaternions (w, x, y, z).\n",
           "| field | type | meaning |\n|---|---|---|",
           f"| `{message.field[0].name}` = {message.field[0].number} | uint64 | {file.comment([MESSAGE, 0, FIELD, 0])} |\n",
           "A receiver that finds no member it knows MUST answer `UNIMPLEMENTED` and go on: newer peers say more.\n"]
    ways = [("To the server", 10, 39), ("Either way", 40, 59), ("To the client", 60, 79), ("In recordings only", 80, 99)]
    for title, low, high in ways:
        out.append(f"## {title}\n\n| message | what it is |\n|---|---|")
        for field in message.field:
            if low <= field.number <= high:
                name = field.type_name.rsplit(".", 1)[1]
                of = files[home["ecorche.v1." + name]]
                path = next(path for path, full, _ in of.messages() if full == name)
                first = re.split(r"(?<=[.:]) ", of.comment(path), maxsplit=1)[0].rstrip(":")
                out.append(f"| {link(field.type_name, home, 'index')} = {field.number} | {first} |")
        out.append("")
    out.append("## By file\n")
    out += [f"- [{TITLES[name]}]({name}.md)" for name in ORDER]
    return "\n".join(out) + "\n"
