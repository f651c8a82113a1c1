#!/usr/bin/python3
"""A server with a net, for tests: both protocols, and every way in which a server fails.

    fake_server.py FOLDER [FAULT=PATH ...]

PUT /fake/faults changes the faults: a line each. Prints its port. Speaks as nnInteractive's server does, or with FOLDER ending in "monai" as MONAI Label's. Its
net is a ball of radius 3 about each point that is included, what a scribble or a box holds, and the image
above 50 for a MONAI model without points. Requests are written to FOLDER/requests, a line each. It ends when its
standard input does.

A fault happens at each request whose path begins with PATH:
    NNN=PATH     status NNN           silence=PATH  no answer, until the client leaves
    cut=PATH     half of the answer   close=PATH    the connection ends without an answer
    damage=PATH  bytes are changed    shape=PATH    an array, or a label map, of another shape
    endless=PATH an answer that goes on   outside=PATH  a box beyond the volume
    notjson=PATH an answer that is not JSON   held=PATH no answer until the faults change
"""

import ctypes
import gzip
import http.server
import json
import struct
import sys
import threading

FOLDER, FAULTS = sys.argv[1], [argument.split("=", 1) for argument in sys.argv[2:]]
IS_MONAI = FOLDER.endswith("monai")
ZSTD = ctypes.CDLL("libzstd.so.1")
LOCK, CHANGED = threading.Lock(), threading.Condition()
EDITED = {"spleen": 2, "liver": 5}  # of "edit 3d", which finds the place (2, 2, 2) of the one that it is not asked for
STATE = {"leases": set(), "shape": None, "mask": None, "sessions": {}, "beats": 0}


def chunk_in(chunk):
    """The bytes of a blosc2 chunk of zstd blocks that are neither split nor shuffled; b"" for others, which are images."""
    if chunk[21] != 0:
        return b""
    nbytes, block = struct.unpack_from("<ii", chunk, 4)
    out = bytearray()
    for start in struct.unpack_from(f"<{(nbytes + block - 1) // block}i", chunk, 32):
        size = min(block, nbytes - len(out))
        (length,) = struct.unpack_from("<i", chunk, start)
        stream = chunk[start + 4 : start + 4 + length]
        if length == size:
            out += stream
        elif length == 0:
            out += bytes(size)
        else:
            made = ctypes.create_string_buffer(size)
            assert ZSTD.ZSTD_decompress(made, ctypes.c_size_t(size), stream, ctypes.c_size_t(length)) == size
            out += made.raw
    return bytes(out)


def array_in(body):
    """(shape, bytes) of an array."""
    magic, version, codec, ndim, letters = struct.unpack_from("<4sBBBB", body)
    assert magic == b"NNIA" and version == 1 and codec == 1
    at = 8 + letters
    shape = struct.unpack_from(f"<{ndim}q", body, at)
    at += 8 * ndim
    (chunks,) = struct.unpack_from("<I", body, at)
    at += 4
    parts = []
    for _ in range(chunks):
        _, length = struct.unpack_from("<QQ", body, at)
        parts.append(chunk_in(body[at + 16 : at + 16 + length]))
        at += 16 + length
    assert at == len(body)
    return shape, b"".join(parts)


def array_of(shape, data):
    """An array in one chunk that holds its bytes as they are (blosc2's flag of a plain copy)."""
    chunk = struct.pack("<BBBBiii", 5, 1, 0x97, 1, len(data), max(1, len(data)), 32 + len(data)) + bytes(16) + data
    return (struct.pack("<4sBBBB", b"NNIA", 1, 1, len(shape), 5) + b"uint8"
            + struct.pack(f"<{len(shape)}q", *shape) + struct.pack("<IQQ", 1, len(data), len(chunk)) + chunk)


def paint(box, holds, value):
    """Writes the mask within a box of [begin, end) along z, y, x."""
    (z0, z1), (y0, y1), (x0, x1) = box
    _, ny, nx = STATE["shape"]
    for z in range(z0, z1):
        for y in range(y0, y1):
            for x in range(x0, x1):
                if holds(z, y, x):
                    STATE["mask"][x + nx * (y + ny * z)] = value


def part_of(box):
    (z0, z1), (y0, y1), (x0, x1) = box
    _, ny, nx = STATE["shape"]
    return bytes(STATE["mask"][x + nx * (y + ny * z)]
                 for z in range(z0, z1) for y in range(y0, y1) for x in range(x0, x1))


def nifti_labels(image, points):
    """A .nii.gz like the one that came, of u8 labels: balls about the points of each label, where the first holds, or 3 where the
    image is above 50."""
    head = bytearray(gzip.decompress(image))
    nx, ny, nz = struct.unpack_from("<3h", head, 42)
    kind, bits = struct.unpack_from("<2h", head, 70)
    (offset,) = struct.unpack_from("<f", head, 108)
    values = struct.unpack_from(f"<{nx * ny * nz}" + {2: "B", 4: "h", 16: "f", 256: "b", 512: "H"}[kind],
                                head, int(offset))
    if points is None:
        labels = bytes(3 * (value > 50) for value in values)
    else:
        labels = bytes(next((label for label, places in points
                             if any((x - i) ** 2 + (y - j) ** 2 + (z - k) ** 2 <= 9 for i, j, k in places)), 0)
                       for z in range(nz) for y in range(ny) for x in range(nx))
    struct.pack_into("<2h", head, 70, 2, 8)
    struct.pack_into("<2f", head, 112, 1.0, 0.0)
    return head, int(offset), (nx, ny, nz), labels


class Server(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def fault(self, name):
        return any(kind == name and self.path.startswith(path) for kind, path in FAULTS)

    def answer(self, body, kind="application/json", meta=None, status=200):
        if isinstance(body, dict):
            body = json.dumps(body).encode()
        if self.fault("notjson"):
            body = b"<html>" + body
        if self.fault("damage"):
            body = bytes(b ^ (0x55 if i % 7 == 3 else 0) for i, b in enumerate(body))
        self.send_response(status)
        self.send_header("Content-Type", kind)
        if meta is not None:
            self.send_header("X-Meta", json.dumps(meta))
        if self.fault("endless"):
            self.send_header("Transfer-Encoding", "chunked")
            self.end_headers()
            try:
                while True:
                    self.wfile.write(b"10000\r\n" + bytes(65536) + b"\r\n")
            except OSError:
                return
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body[: len(body) // 2] if self.fault("cut") else body)
        if self.fault("cut"):
            self.close_connection = True

    def changed(self, box):
        """The answer to a hint: the part of the mask in a box."""
        sizes = [end - begin for begin, end in box]
        body = array_of(sizes, part_of(box))
        if self.fault("shape"):
            body = array_of([sizes[0] + 1] + sizes[1:], bytes((sizes[0] + 1) * sizes[1] * sizes[2]))
        if self.fault("outside"):
            box = [[box[0][0], STATE["shape"][0] + 1]] + box[1:]
        self.answer(body, "application/octet-stream", {"ran_prediction": True, "bbox": box})

    def handle_all(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        with LOCK, open(FOLDER + "/requests", "a", encoding="utf-8") as log:
            log.write(f"{self.command} {self.path} {len(body)} {self.headers.get('Authorization', '-')}\n")
        if self.path == "/fake/faults":
            with CHANGED:
                FAULTS[:] = [line.split("=", 1) for line in body.decode().splitlines()]
                CHANGED.notify_all()
            return self.answer({})
        if self.fault("close"):
            self.close_connection = True
            return None
        if self.fault("silence"):
            self.rfile.read(1)  # until the client leaves
            self.close_connection = True
            return None
        with CHANGED:
            CHANGED.wait_for(lambda: not self.fault("held"))
        for kind, path in FAULTS:
            if kind.isdigit() and self.path.startswith(path):
                return self.answer({"detail": "as told"}, status=int(kind))
        with LOCK:
            return self.monai(body) if IS_MONAI else self.interactive(body)

    do_GET = do_POST = do_PUT = do_DELETE = handle_all

    def interactive(self, body):
        meta = json.loads(self.headers.get("X-Meta", "{}"))
        if self.path == "/healthz":
            return self.answer({"ok": True})
        if self.path == "/claim":
            token = f"lease{len(STATE['leases'])}"
            STATE["leases"].add(token)
            return self.answer({"lease_token": token, "idle_timeout_seconds": 600, "liveness_timeout_seconds": 0.1})
        if self.path == "/release":
            STATE["leases"].discard(self.headers.get("X-Lease-Token"))
            return self.answer({"released": True})
        if self.headers.get("X-Lease-Token") not in STATE["leases"]:
            return self.answer({"detail": "lease expired or unknown"}, status=410)
        if self.path == "/capabilities":
            return self.answer({"supported_interactions": {"points": True, "bbox2d": True, "scribble": True, "lasso": False},
                                "license": "CC BY-NC-SA 4.0", "supports_undo": True, "preferred_scribble_thickness": 2,
                                "supports_initial_label": True, "inference_session_version": "2.2"})
        if self.path == "/heartbeat":
            return self.answer({"remaining_seconds": 599.0})
        if self.path == "/set_image":
            STATE["shape"] = array_in(body)[0][1:]
            return self.answer({"original_image_shape": [1, *STATE["shape"]]})
        size = 1
        for n in STATE["shape"]:
            size *= n
        whole = [[0, n] for n in STATE["shape"]]
        if self.path in ("/set_target_buffer", "/reset_interactions"):
            STATE["mask"], STATE["before"] = bytearray(size), bytearray(size)
            return self.answer({})
        if self.path == "/undo":
            STATE["mask"] = bytearray(STATE["before"])
            return self.changed(whole)
        STATE["before"] = bytearray(STATE["mask"])
        if self.path == "/add_initial_seg_interaction":
            STATE["mask"] = bytearray(array_in(body)[1])
            return self.answer(b"", "application/octet-stream", {"ran_prediction": False, "bbox": None})
        if self.path == "/add_point_interaction":
            asked = json.loads(body)
            place = asked["coordinates"]
            box = [[max(0, p - 3), min(n, p + 4)] for p, n in zip(place, STATE["shape"])]
            paint(box, lambda *at: sum((a - p) ** 2 for a, p in zip(at, place)) <= 9, int(asked["include_interaction"]))
            return self.changed(box)
        if self.path == "/add_bbox_interaction":
            asked = json.loads(body)
            paint(asked["bbox_coords"], lambda *_: True, int(asked["include_interaction"]))
            return self.changed(asked["bbox_coords"])
        if self.path in ("/add_scribble_interaction", "/add_lasso_interaction"):
            box, (shape, data) = meta["interaction_bbox"], array_in(body)
            if list(shape) != [end - begin for begin, end in box]:
                return self.answer({"detail": "shape"}, status=400)
            (z0, _), (y0, _), (x0, _) = box
            paint(box, lambda z, y, x: data[x - x0 + shape[2] * (y - y0 + shape[1] * (z - z0))],
                  int(meta["include_interaction"]))
            return self.changed(box)
        return self.answer({"detail": "Not Found"}, status=404)

    def monai(self, body):
        path, _, query = self.path.partition("?")
        parts = {}
        boundary = self.headers.get("Content-Type", "").partition("boundary=")[2]
        for part in body.split(("--" + boundary).encode())[1:-1] if boundary else []:
            head, _, data = part[2:-2].partition(b"\r\n\r\n")
            parts[head.decode().partition('name="')[2].partition('"')[0]] = data
        if path == "/info/":
            return self.answer({"name": "fake", "models": {
                "spleen": {"type": "segmentation", "labels": {"spleen": 3}, "dimension": 3, "config": {"license": "Apache-2.0"}},
                "edit 3d": {"type": "deepedit", "labels": EDITED, "dimension": 3}}})
        if path == "/session/" and self.command == "PUT":
            STATE["sessions"]["s 1"] = parts["files"]
            return self.answer({"session_id": "s 1"})
        if path == "/session/s%201" and self.command == "DELETE":
            del STATE["sessions"]["s 1"]
            return self.answer({})
        if path in ("/infer/spleen", "/infer/edit%203d"):
            image = STATE["sessions"]["s 1"] if "session_id=s%201" in query else parts["file"]
            asked = json.loads(parts["params"])
            points = [(label, asked.get(name, [[2, 2, 2]])) for name, label in EDITED.items()] if "edit" in path else None
            head, offset, (nx, ny, nz), labels = nifti_labels(image, points)
            if self.fault("shape"):
                struct.pack_into("<h", head, 42, nx - 1)
                labels = bytes((nx - 1) * ny * nz)
            if self.fault("outside"):
                struct.pack_into("<f", head, 292, 1e4)  # the last number of the first row of the affine
            file = gzip.compress(bytes(head[:offset]) + labels)
            return self.answer(b"--B\r\nContent-Disposition: form-data; name=\"params\"\r\nContent-Type: application/json\r\n\r\n"
                               b"{}\r\n--B\r\nContent-Disposition: form-data; name=\"image\"; filename=\"a.nii.gz\"\r\n\r\n"
                               + file + b"\r\n--B--\r\n", "multipart/form-data; boundary=B")
        return self.answer({"detail": "Not Found"}, status=404)


server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Server)
server.daemon_threads = True
print(server.server_address[1], flush=True)
threading.Thread(target=server.serve_forever, daemon=True).start()
sys.stdin.read()
