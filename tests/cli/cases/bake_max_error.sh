# As few rays as an error of opacity asks for; the manifest says what it is.
bake() { texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" "$@"; }
bake --max-error 0.01 --force && texel check cube.texel
python3 -c "import json; e = json.load(open('cube.texel/manifest.json'))['error']; print([round(e['alpha_rms_' + a]['value'], 6) for a in 'xyz'], e['alpha_rms_x']['how'])"
texel bake --recipe cube.texel "$DATA/cube.obj" -o again.texel && diff -r cube.texel/volume.vdb again.texel/volume.vdb
texel bake --hypertexture eroded -r 16 -o rock.texel --max-error 0.01
python3 -c "import json; e = json.load(open('rock.texel/manifest.json'))['error']; print([0 < e['alpha_rms_' + a]['value'] <= 0.01 for a in 'xyz'], e['alpha_rms_z']['how'].split('; 95')[0])"
