"""Render the volume of a texel pack in Blender (Cycles, CPU), and the mesh it was made from beside it.

    blender -b --factory-startup -P blender_pack.py -- PACK [MESH…] -o OUT.png [options]

PACK   a pack's folder (NAME.texel) that holds the grid `density`, and `Cd` if it shall have colour
MESH   what the pack was made from (.obj, .ply, .stl, .off): OUT.png becomes mesh | volume | difference, and how far the two
       lie apart is printed: offset in voxels, root mean square of alpha and colour

  -o, --output OUT.png   the picture
  --mode look|exact      look: a sun, ambient light and a scattering volume [look]
                         exact: no light; the volume absorbs and glows with its own colour, the mesh glows with its diffuse
                         colour: alpha and colour can be compared number by number
  --albedo surface|cd    look only. cd: Cd as it is on the volume's colour, which comes out darker than the same colour on a
                         surface, since light is scattered many times; surface: turned into the albedo of a particle whose
                         thick medium is as bright as Cd [surface]
  --edge soft|sharp      soft: the grids as they are; Blender interpolates, and closed bodies come out nearly a voxel larger
                         all around. sharp: where the grid `solid` is there but below 1/2 nothing is drawn, and outlines lie
                         where the mesh has them; closed parts thinner than half a voxel vanish. Open parts stay [soft]
  --view NAME|AZ,EL      front, back, left, right, top, corner; or degrees about +Z (0: from +X, -90: from -Y) and above
                         the horizon, written --view=AZ,EL [corner: -60,20]
  --camera ortho|persp   persp has a field of view of 30 degrees [ortho]
  --level N              level of the pack, 0 the finest [0]
  --half-voxel on|off    move the volume by -h/2 along each axis, see below [on]
  --size N               pixels along the square picture's side [360]
  --samples N            rays per pixel [64]
  --background R,G,B     linear, laid behind; none: the picture has alpha [none; 0.2,0.2,0.2 with MESH]
  --blend FILE.blend     keep the scene, to go on with it in Blender's window

The half voxel. A pack's grids put the value of index i at origin + h*(i + 1/2), the middle of its voxel, as OpenVDB means it.
Blender 3.4 (measured) draws it h/2 too far along each axis, so the object is moved by -h/2. The file is right as it is; the
shift belongs to the program. Should another version not need it, the offset printed with MESH says so: use --half-voxel off.

Density needs no factor: it is extinction per world unit. Cd is linear. Wrong arguments or packs end with one line and status 1.
"""
import argparse
import hashlib
import json
import math
import os
import sys
import tempfile

import bpy
import numpy
from mathutils import Matrix, Vector

NAMED_VIEWS = {"front": (-90, 0), "back": (90, 0), "left": (180, 0), "right": (0, 0), "top": (-90, 90), "corner": (-60, 20)}
FIELD_OF_VIEW = math.radians(30)
FRAME = 1.04              # room around the object's box
SUN = 3.0                 # W/m^2; with AMBIENT a white wall facing the sun comes out near 1
SUN_SIZE = math.radians(5)
AMBIENT = 0.35
GREY = 0.5                # albedo where there is no material; texel's own default
VOLUME_BOUNCES = 32       # dense and bright: fewer make it visibly darker
TRANSPARENT_BOUNCES = 64  # leaves that are cut out stand behind each other
STEP_RATE = 0.5           # of a voxel; 0.25 and 0.1 gave the same picture
BLUR = 2                  # voxels; far more than the offset looked for
OFFSET_WARNING = 0.25     # voxel; the half voxel stands out, noise does not


class Fault(Exception):
    """Something the user can mend; told in one line."""


class Parser(argparse.ArgumentParser):
    def error(self, message):
        raise Fault(f"{message}; --help tells more")

    def format_help(self):
        return __doc__


# ---------------------------------------------------------------------------------------------- command line and pack

def parse_view(text):
    if text in NAMED_VIEWS:
        return NAMED_VIEWS[text]
    try:
        azimuth, elevation = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: one of {', '.join(NAMED_VIEWS)}, or two numbers AZ,EL") from None
    return azimuth, elevation


def parse_color(text):
    try:
        red, green, blue = (float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: three numbers R,G,B") from None
    return red, green, blue


def count(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: at least 1")
    return value


def parse_arguments(argv):
    parser = Parser()
    parser.add_argument("pack")
    parser.add_argument("mesh", nargs="*")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--mode", choices=("look", "exact"), default="look")
    parser.add_argument("--albedo", choices=("surface", "cd"), default="surface")
    parser.add_argument("--edge", choices=("soft", "sharp"), default="soft")
    parser.add_argument("--view", type=parse_view, default=NAMED_VIEWS["corner"])
    parser.add_argument("--camera", choices=("ortho", "persp"), default="ortho")
    parser.add_argument("--level", type=int, default=0)
    parser.add_argument("--half-voxel", choices=("on", "off"), default="on")
    parser.add_argument("--size", type=count, default=360)
    parser.add_argument("--samples", type=count, default=64)
    parser.add_argument("--background", type=parse_color)
    parser.add_argument("--blend")
    return parser.parse_args(argv)


def read_manifest(pack):
    path = os.path.join(pack, "manifest.json")
    try:
        with open(path, encoding="utf-8") as file:
            manifest = json.load(file)
    except (OSError, UnicodeDecodeError, ValueError) as error:
        raise Fault(f"{pack}: no pack: {path}: {error}") from None
    if not isinstance(manifest, dict) or manifest.get("format") != "texel-pack":
        raise Fault(f"{path}: not the manifest of a texel pack")
    try:
        for level in manifest["levels"]:
            level["file"], level["sha256"], float(level["voxel_size"])
        for corner in ("min", "max"):
            _, _, _ = (float(number) for number in manifest["box"][corner])
    except (KeyError, TypeError, ValueError) as error:
        raise Fault(f"{path}: box or levels are not as they should be ({error}); bake the pack again") from None
    return manifest


def chosen_level(pack, manifest, number):
    """The level's file, whole (Blender would abort on a damaged one), and its voxel edge."""
    levels = manifest["levels"]
    if not levels:
        raise Fault(f"{pack}: the pack has no volume; bake it with --want renderer")
    if not 0 <= number < len(levels):
        raise Fault(f"{pack}: no level {number}; the pack has 0 to {len(levels) - 1}")
    path = os.path.join(pack, levels[number]["file"])
    try:
        with open(path, "rb") as file:
            digest = hashlib.sha256(file.read()).hexdigest()
    except OSError as error:
        raise Fault(f"{path}: {error.strerror}; texel check tells what else is wrong") from None
    if digest != levels[number]["sha256"]:
        raise Fault(f"{path}: not the file the manifest names, damaged or exchanged; bake the pack again")
    return path, float(levels[number]["voxel_size"])


def check_writable(path):
    """Before the long work, not after it."""
    folder = os.path.dirname(os.path.abspath(path))
    if not os.path.isdir(folder) or not os.access(folder, os.W_OK):
        raise Fault(f"{path}: cannot be written: {folder} is no folder, or closed to writing")


# ------------------------------------------------------------------------------------------------------ shading nodes

class Nodes:
    """The nodes of one material, linked as they are made: an input is a socket, or a plain value."""

    def __init__(self, name):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.tree.nodes.new("ShaderNodeOutputMaterial")

    def add(self, kind, inputs=(), **settings):
        node = self.tree.nodes.new(kind)
        for name, value in settings.items():
            setattr(node, name, value)
        for key, value in dict(inputs).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = value
        return node

    def math(self, operation, *operands):
        return self.add("ShaderNodeMath", enumerate(operands), operation=operation).outputs[0]

    def times(self, left, right):
        return self.add("ShaderNodeVectorMath", {0: left, 1: right}, operation="MULTIPLY").outputs[0]

    def finish(self, place, shader):
        self.tree.links.new(shader, self.output.inputs[place])
        return self.material


def particle_albedo(nodes, surface):
    """Single-scattering albedo 1 - s^2 of the isotropic half space that reflects `surface` under even light: van de Hulst's
    approximation, solved for s as Kulla and Conty do (course on physically based shading, 2017)."""
    root = nodes.math("SQRT", nodes.math("ADD", 9.59217, nodes.math("MULTIPLY", surface, nodes.math(
        "ADD", 41.6808, nodes.math("MULTIPLY", surface, 17.7126)))))
    s = nodes.math("SUBTRACT", nodes.math("ADD", 4.09712, nodes.math("MULTIPLY", surface, 4.20863)), root)
    return nodes.math("SUBTRACT", 1.0, nodes.math("MULTIPLY", s, s))


def particle_color(nodes, color):
    split = nodes.add("ShaderNodeSeparateXYZ", {0: color})
    parts = [particle_albedo(nodes, split.outputs[axis]) for axis in range(3)]
    return nodes.add("ShaderNodeCombineXYZ", enumerate(parts)).outputs[0]


def volume_material(grids, options):
    nodes = Nodes("pack")
    density = nodes.add("ShaderNodeAttribute", attribute_name="density").outputs["Fac"]
    if options.edge == "sharp":
        if "solid" not in grids:
            raise Fault(f"{options.pack}: --edge sharp needs the grid solid, which closed meshes have (has {', '.join(grids)})")
        solid = nodes.add("ShaderNodeAttribute", attribute_name="solid").outputs["Fac"]
        outside = nodes.math("MULTIPLY", nodes.math("GREATER_THAN", solid, 0.0), nodes.math("LESS_THAN", solid, 0.5))
        density = nodes.math("MULTIPLY", density, nodes.math("SUBTRACT", 1.0, outside))
    if "Cd" in grids:
        color = nodes.add("ShaderNodeAttribute", attribute_name="Cd").outputs["Vector"]
    else:
        color = nodes.add("ShaderNodeCombineXYZ", enumerate([GREY] * 3)).outputs[0]
    if options.mode == "exact":
        absorb = nodes.add("ShaderNodeVolumeAbsorption", {"Color": (0, 0, 0, 1), "Density": density})
        glow = nodes.add("ShaderNodeEmission", {"Color": color, "Strength": density})
        both = nodes.add("ShaderNodeAddShader", {0: absorb.outputs[0], 1: glow.outputs[0]})
        return nodes.finish("Volume", both.outputs[0])
    if options.albedo == "surface":
        color = particle_color(nodes, color)
    # The node's own attribute names would multiply the grids in once more.
    scatter = nodes.add("ShaderNodeVolumePrincipled", {"Color": color, "Density": density, "Density Attribute": "",
                                                       "Color Attribute": "", "Temperature Attribute": ""})
    return nodes.finish("Volume", scatter.outputs[0])


def linked_image(shader, socket):
    """The image an importer put before a socket of its Principled BSDF."""
    if socket not in shader.inputs or not shader.inputs[socket].is_linked:
        return None
    node = shader.inputs[socket].links[0].from_node
    return node.image if node.type == "TEX_IMAGE" else None


def mesh_material(imported, vertex_colors, mode):
    """Lambert (or glow) with the colour and the cut-outs of an imported material, without its gloss: the volume has none."""
    base, picture, mask = (GREY, GREY, GREY), None, None
    shaders = [n for n in imported.node_tree.nodes if n.type == "BSDF_PRINCIPLED"] if imported and imported.use_nodes else []
    if shaders:
        base = tuple(shaders[0].inputs["Base Color"].default_value)[:3]
        picture, mask = linked_image(shaders[0], "Base Color"), linked_image(shaders[0], "Alpha")
    elif vertex_colors:
        base = (1, 1, 1)
    nodes = Nodes("mesh")
    color = nodes.add("ShaderNodeCombineXYZ", enumerate(base)).outputs[0]
    if vertex_colors:
        color = nodes.times(color, nodes.add("ShaderNodeAttribute", attribute_name=vertex_colors).outputs["Color"])
    coverage = None
    if picture:
        picture.alpha_mode = "CHANNEL_PACKED"  # else the colour comes multiplied by alpha
        # Cycles would interpolate the stored sRGB numbers, which darkens rough textures (bonsai: 5 %); many rays make up for it.
        read = nodes.add("ShaderNodeTexImage", image=picture, interpolation="Closest")
        color = nodes.times(color, read.outputs["Color"])
        coverage = read.outputs["Alpha"]
    if mask:
        coverage = nodes.add("ShaderNodeTexImage", image=mask).outputs["Color"]
    kind = "ShaderNodeEmission" if mode == "exact" else "ShaderNodeBsdfDiffuse"
    surface = nodes.add(kind, {"Color": color}).outputs[0]
    if coverage is not None:
        hole = nodes.add("ShaderNodeBsdfTransparent")
        surface = nodes.add("ShaderNodeMixShader", {0: coverage, 1: hole.outputs[0], 2: surface}).outputs[0]
    return nodes.finish("Surface", surface)


# ------------------------------------------------------------------------------------------------------------ objects

def link(name, data):
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def add_volume(path, voxel, options):
    volume = bpy.data.volumes.new("pack")
    volume.filepath = os.path.abspath(path)
    volume.grids.load()  # a file that cannot be read is no error to Blender: only the list of grids stays empty
    names = [grid.name for grid in volume.grids]
    if "density" not in names:
        found = f"has {', '.join(names)}" if names else volume.grids.error_message or "no grid could be read"
        raise Fault(f"{path}: no grid density ({found}); bake the pack with --want renderer")
    if "Cd" not in names:
        print(f"blender_pack: {path}: no grid Cd, drawn grey; bake the pack with color in --want")
    volume.render.space = "WORLD"
    volume.render.precision = "FULL"  # densities of small scenes are beyond what half holds
    volume.render.clipping = 0        # ... and those of large ones below the default threshold
    volume.materials.append(volume_material(names, options))
    thing = link("pack", volume)
    if options.half_voxel == "on":
        thing.location = [-voxel / 2] * 3
    return thing


def read_off(path):
    with open(path, encoding="ascii", errors="replace") as file:
        words = (word for line in file for word in line.split("#")[0].split())
        try:
            first = next(words)
            if not first.endswith("OFF"):
                raise Fault(f"{path}: not an OFF file")
            if first != "OFF":
                raise Fault(f"{path}: {first} is more than this little reader knows; make it OBJ or PLY")
            points, faces, _ = (int(next(words)) for _ in range(3))
            vertices = [tuple(float(next(words)) for _ in range(3)) for _ in range(points)]
            polygons = [tuple(int(next(words)) for _ in range(int(next(words)))) for _ in range(faces)]
        except (StopIteration, RuntimeError, ValueError) as error:
            raise Fault(f"{path}: cut off, or not plain OFF: {error}") from None
    if any(not 0 <= index < points for polygon in polygons for index in polygon):
        raise Fault(f"{path}: a face names a vertex that is not there")
    mesh = bpy.data.meshes.new("mesh")
    mesh.from_pydata(vertices, [], polygons)
    return [link("mesh", mesh)]


def run_importer(path, extension):
    """Blender 3.4's operators; later versions moved PLY and STL."""
    if extension == ".obj":
        bpy.ops.wm.obj_import(filepath=path, forward_axis="Y", up_axis="Z")  # that is: turn nothing
    elif f"{extension[1:]}_import" in dir(bpy.ops.wm):
        getattr(bpy.ops.wm, f"{extension[1:]}_import")(filepath=path, forward_axis="Y", up_axis="Z")
    else:
        getattr(bpy.ops.import_mesh, extension[1:])(filepath=path)


def add_mesh(path, mode):
    extension = os.path.splitext(path)[1].lower()
    if not os.path.isfile(path):
        raise Fault(f"{path}: the file is missing")
    if extension not in (".obj", ".ply", ".stl", ".off"):
        raise Fault(f"{path}: not a mesh this script reads (.obj, .ply, .stl, .off)")
    before = set(bpy.data.objects)
    if extension == ".off":
        things = read_off(path)
    else:
        try:
            run_importer(path, extension)
        except RuntimeError as error:
            raise Fault(f"{path}: Blender cannot read it: {error}") from None
        things = [thing for thing in bpy.data.objects if thing not in before and thing.type == "MESH"]
    if not any(len(thing.data.polygons) for thing in things):
        raise Fault(f"{path}: no faces found in it")
    for thing in things:
        colors = thing.data.color_attributes
        vertex_colors = colors[0].name if len(colors) else None
        imported = list(thing.data.materials) or [None]
        made = [mesh_material(material, vertex_colors, mode) for material in imported]
        used = [polygon.material_index for polygon in thing.data.polygons]
        thing.data.materials.clear()
        for material in made:
            thing.data.materials.append(material)
        thing.data.polygons.foreach_set("material_index", used)
    return things


# --------------------------------------------------------------------------------------------- camera, light, picture

def add_camera(box, view, kind):
    """Returns the width of the picture in world units, at the depth of the box's middle."""
    low, high = Vector(box["min"]), Vector(box["max"])
    middle = (low + high) / 2
    azimuth, elevation = (math.radians(angle) for angle in view)
    away = Vector((math.cos(azimuth) * math.cos(elevation), math.sin(azimuth) * math.cos(elevation), math.sin(elevation)))
    right = Vector((-math.sin(azimuth), math.cos(azimuth), 0))
    up = away.cross(right)
    corners = [Vector((x, y, z)) - middle for x in (low.x, high.x) for y in (low.y, high.y) for z in (low.z, high.z)]
    half = max(max(abs(corner.dot(right)), abs(corner.dot(up))) for corner in corners) * FRAME
    reach = max(corner.length for corner in corners)
    data = bpy.data.cameras.new("camera")
    if kind == "ortho":
        data.type, data.ortho_scale, distance = "ORTHO", 2 * half, 2 * reach
    else:
        data.angle = FIELD_OF_VIEW
        slope = math.tan(FIELD_OF_VIEW / 2)
        distance = FRAME * max(max(abs(corner.dot(right)), abs(corner.dot(up))) / slope + corner.dot(away)
                               for corner in corners)
        half = distance * slope
    data.clip_start, data.clip_end = distance / 1000, distance + 2 * reach
    camera = link("camera", data)
    camera.matrix_world = Matrix.Translation(middle + away * distance) @ Matrix((right, up, away)).transposed().to_4x4()
    bpy.context.scene.camera = camera
    return 2 * half


def add_light(view):
    azimuth, elevation = math.radians(view[0] - 40), math.radians(45)  # over the viewer's left shoulder
    back = Vector((math.cos(azimuth) * math.cos(elevation), math.sin(azimuth) * math.cos(elevation), math.sin(elevation)))
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = SUN, SUN_SIZE
    link("sun", sun).rotation_euler = back.to_track_quat("Z", "Y").to_euler()


def set_up(options):
    scene = bpy.context.scene
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = options.samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.volume_step_rate = STEP_RATE
    scene.cycles.volume_bounces = VOLUME_BOUNCES if options.mode == "look" else 0
    scene.cycles.max_bounces = max(scene.cycles.max_bounces, VOLUME_BOUNCES)
    scene.cycles.transparent_max_bounces = TRANSPARENT_BOUNCES
    scene.render.resolution_x = scene.render.resolution_y = options.size
    scene.render.resolution_percentage = 100
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Standard"  # the default, Filmic or AgX, changes colours
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    ambient = AMBIENT if options.mode == "look" else 0
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = ambient
    scene.world = world
    if options.mode == "look":
        add_light(options.view)


def render(shown, hidden):
    """Linear RGBA, premultiplied; rows from below."""
    scene = bpy.context.scene
    for thing in shown + hidden:
        thing.hide_render = thing in hidden
    with tempfile.TemporaryDirectory() as folder:
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.image_settings.color_mode = "RGBA"
        scene.render.image_settings.color_depth = "32"
        scene.render.filepath = os.path.join(folder, "picture.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = numpy.empty(len(image.pixels), dtype=numpy.float32)
        image.pixels.foreach_get(pixels)
        shape = (image.size[1], image.size[0], 4)
        bpy.data.images.remove(image)
    return pixels.reshape(shape).astype(numpy.float64)


def over(picture, background):
    if background is None:
        return picture
    behind = numpy.array([*background, 1.0])
    return picture + (1 - picture[:, :, 3:]) * behind


def save(picture, path):
    """Through Blender's own view transform, Standard."""
    scene = bpy.context.scene
    image = bpy.data.images.new("out", picture.shape[1], picture.shape[0], alpha=True, float_buffer=True)
    image.alpha_mode = "PREMUL"
    image.pixels.foreach_set(picture.astype(numpy.float32).ravel())
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth, settings.compression = "PNG", "RGBA", "8", 100
    if picture[:, :, 3].min() >= 1:
        settings.color_mode = "RGB"
    try:
        image.save_render(os.path.abspath(path), scene=scene)
    except RuntimeError as error:
        raise Fault(f"{path}: cannot be written: {error}") from None


# --------------------------------------------------------------------------------------------------------- comparison

def centroid(alpha):
    rows, columns = numpy.indices(alpha.shape)
    return numpy.array([(columns * alpha).sum(), (rows * alpha).sum()]) / alpha.sum()


def blurred(alpha, sigma):
    """A Gaussian, through the frequencies; the border is padded so that nothing comes round."""
    wide = numpy.pad(alpha, math.ceil(4 * sigma))
    down, across = (numpy.fft.fftfreq(size)[:, None] for size in wide.shape)
    filtered = numpy.fft.fft2(wide) * numpy.exp(-2 * (math.pi * sigma) ** 2 * (down ** 2 + across.T ** 2))
    return numpy.fft.ifft2(filtered).real


def fitted_offset(mesh, volume, sigma):
    """The shift that takes the mesh's alpha to the volume's, by least squares over blurred pictures: wide slopes make it linear.
    A rim of even width cancels out in it, whereas the centroid goes where the object has more rim."""
    mesh, volume = blurred(mesh, sigma), blurred(volume, sigma)
    down, across = numpy.gradient((mesh + volume) / 2)
    slopes = numpy.stack([-across.ravel(), -down.ravel()], axis=1)
    return numpy.linalg.lstsq(slopes, (volume - mesh).ravel(), rcond=None)[0]


def compare(mesh, volume, width, voxel, options):
    pixels_per_voxel = voxel * mesh.shape[1] / width
    alpha_mesh, alpha_volume = mesh[:, :, 3], volume[:, :, 3]
    if not alpha_mesh.any() or not alpha_volume.any():
        raise Fault("nothing to compare: the mesh or the volume is outside the picture; is MESH the pack's source?")
    matter = (alpha_mesh > 0) | (alpha_volume > 0)
    difference = (volume - mesh)[matter]
    moved = (centroid(alpha_volume) - centroid(alpha_mesh)) / pixels_per_voxel
    fitted = fitted_offset(alpha_mesh, alpha_volume, BLUR * pixels_per_voxel) / pixels_per_voxel
    outline = numpy.hypot(*numpy.gradient(alpha_mesh)).sum()
    growth = (alpha_volume.sum() - alpha_mesh.sum()) / outline / pixels_per_voxel
    inner = (alpha_mesh > 0.999) & (alpha_volume > 0.999)
    print(f"blender_pack: mode {options.mode}, view {options.view[0]:g},{options.view[1]:g}, {options.camera}, "
          f"edge {options.edge}, level {options.level}, half voxel {options.half_voxel}, {options.samples} rays, "
          f"{pixels_per_voxel:.3f} pixels a voxel")
    print(f"blender_pack: offset {fitted[0]:+.3f} {fitted[1]:+.3f} voxel (right, up; least squares); "
          f"of the alpha's centroid {moved[0]:+.3f} {moved[1]:+.3f}")
    print(f"blender_pack: alpha: sum {alpha_volume.sum() / alpha_mesh.sum():.4f} of the mesh's, as if the outline lay "
          f"{growth:+.3f} voxel further out; RMS difference "
          f"{rms(difference[:, 3]):.4f} over the {matter.mean():.1%} with matter, "
          f"{rms((alpha_volume - alpha_mesh).ravel()):.4f} over the picture")
    print(f"blender_pack: colour (linear, premultiplied): RMS difference {rms(difference[:, :3]):.4f} with matter; "
          + (f"{rms((volume - mesh)[inner][:, :3]):.4f} where both are opaque; mean "
             f"{show(volume[inner][:, :3].mean(axis=0))} against the mesh's {show(mesh[inner][:, :3].mean(axis=0))}"
             if inner.any() else "nowhere are both opaque"))
    if max(abs(fitted)) > OFFSET_WARNING:
        print(f"blender_pack: the two lie more than {OFFSET_WARNING:g} voxel apart: is MESH the pack's source? "
              "Is --half-voxel right for this version of Blender?")


def rms(values):
    return math.sqrt(float((values * values).mean()))


def show(color):
    return " ".join(f"{part:.3f}" for part in color)


def main(argv):
    options = parse_arguments(argv)
    for path in filter(None, (options.output, options.blend)):
        check_writable(path)
    manifest = read_manifest(options.pack)
    path, voxel = chosen_level(options.pack, manifest, options.level)
    set_up(options)
    volume = [add_volume(path, voxel, options)]
    mesh = [thing for file in options.mesh for thing in add_mesh(file, options.mode)]
    width = add_camera(manifest["box"], options.view, options.camera)
    if options.blend:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(options.blend))
    picture = render(volume, mesh)
    if mesh:
        truth = render(mesh, volume)
        compare(truth, picture, width, voxel, options)
        background = options.background or (0.2, 0.2, 0.2)
        both = [over(truth, background), over(picture, background)]
        difference = numpy.abs(both[1] - both[0])
        difference[:, :, 3] = 1
        picture = numpy.concatenate(both + [difference], axis=1)
    else:
        picture = over(picture, options.background)
    save(picture, options.output)
    print(f"blender_pack: {options.output} written")


if __name__ == "__main__":
    try:
        main(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else ["--help"])
    except Fault as fault:
        print(f"blender_pack: error: {fault}", file=sys.stderr)
        sys.exit(1)
