# What is counted is a whole number.
texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" --report report.json && python3 -c "
import json
report = json.load(open('report.json'))
print(report['counts']['border voxels'], report['counts']['samples'], isinstance(report['peak_memory'], int))"
