printf "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n01234567" > v.mha
texel bake v.mha -o x.texel
