# Which scene of a glTF file: its own choice with a warning, another one, one that is not there; from the pack's recipe again.
printf '%s' '{"asset":{"version":"2.0"},"scenes":[{"nodes":[0],"name":"one"},{"nodes":[0,1]}],"nodes":[{"mesh":0},{"mesh":0,"translation":[3,0,0]}],
"buffers":[{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],"bufferViews":[{"buffer":0,"byteLength":36}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}]}' > two.gltf
bake() { texel bake "$@" -r 8 --want density 2>&1 | grep -v mesh-open | sed 's/, [0-9.]* s$//'; }
bake two.gltf -o own.texel
bake two.gltf --scene 1 -o one.texel
bake two.gltf --scene auto -o own.texel
bake --recipe one.texel -o again.texel
for n in 2 -1 x; do texel bake two.gltf --scene $n -o none.texel; echo "$?" >&2; done
printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' > a.obj
texel bake a.obj --scene 1 -o none.texel; echo "$?" >&2
texel view one.texel -o truth.png --truth --size 32x32 --samples 1 && ls truth.png
